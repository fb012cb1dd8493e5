# mechlab with a browser for its tests: docker build -t mechlab . && docker run --rm -v "$PWD/out:/lab/out" mechlab
FROM python:3.12-slim
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends \
        git chromium libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libosmesa6 && rm -rf /var/lib/apt/lists/*
WORKDIR /lab
COPY . .
# the README's two commands, their installation first
RUN python3 -m venv .venv && .venv/bin/pip install -q -e '.[test]'
ENV PATH="/lab/.venv/bin:$PATH" MUJOCO_GL=egl
CMD ["mechlab", "run", "delta6", "-o", "out"]
