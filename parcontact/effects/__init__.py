"""Effects that a job may ask for, each in a folder of its own."""
