"""What a user does with the library: theory, morphing, checking the installation."""
