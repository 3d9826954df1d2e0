"""Every picture, panel by panel."""
