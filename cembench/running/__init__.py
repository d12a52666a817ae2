"""From a plan of cells to records: each cell is measured in a process of its own."""
