"""The sealed challenge at vehicle level: what a vehicle is like, concealed and looked for."""
