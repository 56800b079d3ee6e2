"""Renders of a viewport: in a thread of their own, replaced whenever something changes."""

import threading

import steradian


class Session:
    """One viewport's render. updated: called, in another thread, when there is a new picture or an error."""

    def __init__(self, updated):
        self._updated = updated
        self._thread, self._cancel = None, None
        self._lock = threading.Lock()
        self._scene = None
        self.picture, self.samples, self.error, self.is_done = None, 0, None, True

    def start(self, scene, **settings):
        """Renders another scene, a dictionary in the scene format."""
        self.stop()
        self._scene = scene
        self._run(lambda: steradian.load_dict(scene), settings)

    def move(self, camera, **settings):
        """Renders the same scene from another camera; its geometry is kept."""
        self.stop()
        loaded = self._scene

        def moved():
            if isinstance(loaded, dict):
                return steradian.load_dict({**loaded, "camera": camera})
            loaded["camera"] = camera
            return loaded

        self._run(moved, settings)

    def stop(self):
        """Ends the render under way."""
        if self._thread is not None:
            self._cancel.set()
            self._thread.join()
            self._thread = None

    def wait(self):
        """Waits for the last sample."""
        if self._thread is not None:
            self._thread.join()

    def _run(self, load, settings):
        self._cancel, self.is_done, self.error = threading.Event(), False, None
        self._thread = threading.Thread(target=self._work, args=(load, settings, self._cancel), daemon=True)
        self._thread.start()

    def _work(self, load, settings, cancel):
        try:
            scene = load()
            self._scene = scene
            image = steradian.render(
                scene,
                progress=lambda share: not cancel.is_set(),
                picture=lambda image, samples: self._show(image, samples, cancel),
                picture_every=0.1,
                **settings,
            )
            self._show(image, image.statistics["spp"], cancel)
        except (steradian.SteradianError, ValueError) as error:
            self.error = str(error)
        self.is_done = True
        if not cancel.is_set():
            self._updated()

    def _show(self, image, samples, cancel):
        if not cancel.is_set():
            with self._lock:
                self.picture, self.samples = image["color"].copy(), samples
            self._updated()

    def latest(self):
        """The picture so far, an array of shape (height, width, 4) or None, and its samples per pixel."""
        with self._lock:
            return self.picture, self.samples
