"""What is said of an error and the accuracy that was asked for."""

from parcontact.physics.budget import Parts, advice


def test_an_error_that_is_printed_like_its_limit_is_within_it() -> None:
    """Three digits are printed: 1.004 % of 1 % is no miss, 1.02 % is one."""
    told = [advice(Parts(solver=error, time=0.0, folded=0.0, mesh=0.0), 0.01) for error in (0.01004, 0.0102)]
    assert told[0] == "; within the 1 % that numerics.accuracy asks for"
    assert told[1] == "; more than the 1 % that numerics.accuracy asks for: try a smaller numerics.tolerance"
