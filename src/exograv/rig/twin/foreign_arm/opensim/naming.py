def map_by_names(document, description): raise NotImplementedError
