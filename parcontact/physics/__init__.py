"""The physics of the contact. Nothing here sees a communicator."""
