"""The papers that ship with cembench, one folder each."""
