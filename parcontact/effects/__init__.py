"""Effects that a job may ask for, each in a file of its own."""
