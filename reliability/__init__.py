"""What the cloth withstands, measured: each command here writes rows of docs/reliability.md."""
