"""Pages, figures and tables made from recordings and studies."""
