"""May this fix be used?  The receiver's own word, the EKF's, and what physics allows."""
