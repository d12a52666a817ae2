"""Pictures of surfaces and their maps."""
