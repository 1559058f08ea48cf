"""Experiments over the public interface; nothing else imports them."""
