"""An extension of residuals beyond the contact, which makes a preconditioner of an operator without a contact."""
