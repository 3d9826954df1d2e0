"""Which effects a job calls for, and why; a new effect has its own file here."""
