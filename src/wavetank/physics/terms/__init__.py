"""Terms of a step, one file each: a term is a `Term` and an entry in `builtin.TERMS`; a world may add its own."""
