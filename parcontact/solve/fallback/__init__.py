"""Further attempts at a contact whose solve has failed."""
