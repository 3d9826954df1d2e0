"""What a job will do and cost, before it runs: effects, memory, steps, transforms, messages, time."""
