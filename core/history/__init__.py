"""History: runs and their records in one SQLite file, each record durable the moment it is made."""
