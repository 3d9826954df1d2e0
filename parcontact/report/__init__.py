"""A report to send: one page, in one file, of what was asked, what came out, what it cost and where it comes from."""
