from skimage.transform import EuclideanTransform


def register(source, targets):
    fits = (EuclideanTransform.from_estimate(source, each) for each in targets)
    return [fit.params for fit in fits]
