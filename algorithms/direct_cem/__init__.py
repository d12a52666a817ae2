"""Direct CEM: the conformal energy minimised over the boundary itself, on disks and with holes."""
