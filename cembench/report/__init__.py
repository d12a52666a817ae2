"""Tables and pictures of records; nothing here measures."""
