"""What is simulated. Nothing here sees a communicator."""
