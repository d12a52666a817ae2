"""Records of measurements, where they are stored, and how they are compared."""
