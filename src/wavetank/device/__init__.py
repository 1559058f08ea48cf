"""The kernel compiler, what lies on the device, and launches."""
