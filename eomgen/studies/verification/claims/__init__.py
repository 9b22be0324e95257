"""What each closed form claims: its value, the function it is a derivative of, a second derivation."""
