"""Effects that a job may call for; a new one has its own file here."""
