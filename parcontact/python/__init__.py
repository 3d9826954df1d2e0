"""The public Python interface; `parcontact` exports its parts."""
