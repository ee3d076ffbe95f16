from skimage.transform import EuclideanTransform


def register(source, targets):
    fits = (EuclideanTransform.from_estimate(source, target) for target in targets)
    return [fit.params for fit in fits]
