"""Training of the detector's network: stands apart from the product, which never imports it."""
