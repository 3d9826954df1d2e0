"""Physical effects that a job may turn on, each in a folder of its own."""
