"""Parts that all identification methods share: model, prior, samples, uncertainty."""
