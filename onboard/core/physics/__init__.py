"""The catalogue: every effect that a model may lack, one class in one file each."""
