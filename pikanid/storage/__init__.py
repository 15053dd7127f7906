"""Files and what is kept in them: checked when read, whole when written; processes that end."""
