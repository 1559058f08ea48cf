"""One file per pass, named after what it adds to the picture; `views.VIEWS` has their order. No pass knows another."""
