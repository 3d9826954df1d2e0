"""From a job to its steps: scene, choices, errors, steps in time, and steady sliding."""
