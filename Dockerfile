# Not built where this file was written. Build:  docker build -t mlmem_ros .
# Run:    docker run --rm -it --network host -v mlmem_cache:/cache mlmem_ros
# The volume keeps the compiled kernels: the first start compiles them, for half a minute.
FROM ros:jazzy
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-pip python3-venv \
    && rm -rf /var/lib/apt/lists/*
ENV NUMBA_CACHE_DIR=/cache
VOLUME /cache
COPY . /opt/mlmem_ros
RUN python3 -m venv --system-site-packages /opt/venv \
    && /opt/venv/bin/pip install --no-cache-dir '/opt/mlmem_ros[view]'
ENV PATH=/opt/venv/bin:$PATH
CMD ["memory_node"]
