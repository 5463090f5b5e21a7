"""History: runs and their records in one SQLite file. Each record is durable at once."""
