class Folder:
    def __init__(self, path):
        self.path = path

    def __str__(self):
        return self.path


SITE_PACKAGES = Folder("/lib/python3.14/site-packages")
DSO_DIR = Folder("/usr/lib")


def init_loaded_packages():
    pass


def unpack_buffer(*args, **kwargs):
    raise NotImplementedError("this runtime has its packages in place and unpacks no others")
