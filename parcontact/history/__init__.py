"""The history of a job as steps: its stages, the timeline of their steps, and steps that are chosen during a run."""
