"""What is left over of the arm's weight where no truth exists: postures passed slowly in both directions."""
