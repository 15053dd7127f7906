"""What people and programs get to see: tables, JSON, reports."""
