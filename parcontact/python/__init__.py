"""The public Python interface, of which `parcontact` itself names every part."""
