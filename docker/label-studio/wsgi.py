"""The application that gunicorn runs."""

import os

from bagtrack.adapters.label_studio import BagTrack
from label_studio_ml.api import init_app

app = init_app(model_class=BagTrack, model_dir=os.environ.get("MODEL_DIR", "/data"))
