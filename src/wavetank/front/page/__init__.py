"""The page in the browser: its server, its people, its door."""
