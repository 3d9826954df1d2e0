"""The physics of the contact. No module here uses a communicator."""
