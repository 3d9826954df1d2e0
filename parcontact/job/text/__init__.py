"""Reading a job: YAML text or Python data as plain data that remembers where each value was written."""
