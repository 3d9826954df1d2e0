"""The parts of a job: its text, its sections, and what is said about them. `parcontact.job` is the door."""
