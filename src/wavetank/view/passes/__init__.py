"""One file per pass, named after what it adds to the picture; `renderer.PASSES` is their order."""
