"""Extension of residuals beyond the contact, which turns an inverse without contact into a preconditioner."""
