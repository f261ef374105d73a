"""One package for colcon (ament_python) and for pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = 'cloth_ros'
# What `make docs` needs.
DOCS = ['sphinx', 'myst-parser', 'furo', 'sphinx-copybutton', 'sphinxcontrib-programoutput']
# What examples/many_cloths.py needs.
MANY = ['distributed', 'h5py', 'tqdm']
# What cloth_resimulate needs: bags, a plot, progress; mcap reads files that end too early.
RECORDING = ['rosbags', 'mcap', 'matplotlib', 'tqdm', 'distributed']
# What cloth_export needs: bags, progress; a library for each kind of file.
EXPORT = ['rosbags', 'mcap', 'tqdm', 'usd-core', 'meshio']

setup(
    name=NAME,
    version='0.1.0',
    description='A live mass-spring cloth for ROS 2',
    license='Apache-2.0',
    maintainer='cloth_ros maintainers',
    maintainer_email='cloth_ros@example.org',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: ['py.typed', 'node/fastdds.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/config', sorted(glob('config/*'))),
        (f'share/{NAME}/launch', sorted(glob('launch/*.launch.py'))),
    ],
    python_requires='>=3.10',
    # trimesh reads the files of mesh colliders; it needs nothing but NumPy.  msgspec writes and
    # checks saved states; it needs nothing.
    install_requires=['setuptools', 'numpy', 'numba', 'PyYAML', 'trimesh', 'msgspec'],
    extras_require={
        # The wheels of ROS 2 Jazzy, for machines without ROS.  Where ROS 2 is sourced its own
        # rclpy is used, so they are no requirement of the package itself.
        'ros': ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces'],
        # What the study, cloth_tradeoff, needs; the node does without.
        'tradeoff': ['matplotlib', 'scipy', 'tqdm'],
        # The browser view, cloth_viewer.
        'viewer': ['viser>=1.1'],
        'test': [
            'pytest',
            'pytest-benchmark',
            'pytest-timeout',
            'pytest-xdist',
            'hypothesis',
            'import-linter',
            'ruff',
            'mypy',
            'types-PyYAML',
            'cyclonedds',
            'playwright',
            'shapely',
            'colcon-common-extensions',
            'colcon-ros',
            *DOCS,
            *MANY,
            *RECORDING,
            *EXPORT,
        ],
        'recording': RECORDING,
        'export': EXPORT,
        # What examples/record.py needs.
        'record': ['rosbags'],
        'docs': DOCS,
        'many': MANY,
        'pictures': ['pyvista'],
        # The engines that `make bench` compares with; what cannot be installed is left out there.
        'bench': [
            'pytest',
            'pytest-timeout',
            'pytest-benchmark',
            'taichi; python_version < "3.14"',
            'mujoco',
            'newton',
            'pybullet',
        ],
    },
    entry_points={
        'console_scripts': [
            'cloth_node = cloth_ros.node.main:command',
            'cloth_tradeoff = cloth_ros.tradeoff.main:main',
            'cloth_resimulate = cloth_ros.recording.main:main',
            'cloth_export = cloth_ros.recording.export.main:main',
            'cloth_viewer = cloth_ros.viewer.main:command',
        ]
    },
    zip_safe=False,
)
