"""What pages and notebooks are made of: tables as data, and pieces of HTML."""
