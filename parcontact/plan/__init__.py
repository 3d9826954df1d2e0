"""The plan of a job before it runs: effects, memory, steps, time, and the price of other accuracies."""
