"""What every identification method shares: model, prior, samples, uncertainty."""
