"""The manual: pages as text in pages/, which `parcontact manual` prints and scripts/manual makes into a web site."""
