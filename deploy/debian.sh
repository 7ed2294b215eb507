#!/bin/sh
# Makes onboard-calibration_VERSION_ARCHITECTURE.deb of this checkout, in the folder given (or here).
# Build it on the distribution and architecture it is for: it holds compiled packages for that Python.
# Needs python3-venv, and dpkg-deb as every Debian has it; no compiler.
set -eu
out=$(realpath "${1:-.}")
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
chmod 755 "$work"  # becomes the package's root
name=onboard-calibration
version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' onboard/__init__.py)
architecture=$(dpkg --print-architecture)
python=$(python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
next=$(python3 -c 'import sys; print("%d.%d" % (sys.version_info[0], sys.version_info[1] + 1))')
root="$work/root"
home="$root/usr/lib/onboard"

python3 -m venv "$work/tools"
"$work/tools/bin/pip" --quiet --disable-pip-version-check install --no-compile --target "$home" .
mkdir -p "$root/usr/share/zsh/vendor-completions" "$root/usr/share/doc/$name" "$root/usr/bin" \
    "$root/lib/systemd/system" "$root/etc/onboard" "$root/DEBIAN"
mv "$home/share/man" "$home/share/bash-completion" "$home/share/fish" "$home/share/onboard" "$root/usr/share/"
mv "$home/share/zsh/site-functions/_onboard" "$root/usr/share/zsh/vendor-completions/"
rm -rf "$home/share" "$home/bin"
gzip -9n "$root/usr/share/man/man1/onboard.1"
python3 deploy/slim.py "$home"
find "$home" -name __pycache__ -prune -exec rm -rf {} +

cat > "$root/usr/bin/onboard" <<'PROGRAM'
#!/usr/bin/python3 -I
import sys

sys.path.insert(0, "/usr/lib/onboard")
if __name__ == "__main__":
    from onboard.cli.main import main

    main()
PROGRAM
chmod 755 "$root/usr/bin/onboard"
sed 's,/opt/onboard/bin/onboard,/usr/bin/onboard,' systemd/onboard.service > "$root/lib/systemd/system/onboard.service"
cp systemd/onboard.toml "$root/etc/onboard/onboard.toml"
cp LICENSE "$root/usr/share/doc/$name/copyright"

cat > "$root/DEBIAN/control" <<CONTROL
Package: $name
Version: $version
Architecture: $architecture
Maintainer: onboard <onboard@localhost>
Section: science
Priority: optional
Depends: python3 (>= $python~), python3 (<< $next~)
Installed-Size: $(du -sk "$root" | cut -f1)
Description: in-flight calibration of the accelerometers of MAVLink autopilots
 A service on the companion computer listens to an autopilot while it flies, estimates
 scale and offset of its accelerometers, and writes them when it may.  It is not started
 by the installation: edit /etc/onboard/onboard.toml first.
CONTROL
echo /etc/onboard/onboard.toml > "$root/DEBIAN/conffiles"
cat > "$root/DEBIAN/postinst" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = configure ]; then
    python3 -m compileall -q /usr/lib/onboard
    if [ -d /run/systemd/system ]; then
        systemctl daemon-reload
        systemctl try-restart onboard.service
    fi
fi
SCRIPT
cat > "$root/DEBIAN/prerm" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = remove ] && [ -d /run/systemd/system ]; then
    systemctl disable --now onboard.service
fi
find /usr/lib/onboard -name __pycache__ -prune -exec rm -rf {} +
SCRIPT
cat > "$root/DEBIAN/postrm" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = purge ]; then
    rm -rf /var/lib/private/onboard /var/lib/onboard
fi
if [ -d /run/systemd/system ]; then
    systemctl daemon-reload
fi
SCRIPT
chmod 755 "$root/DEBIAN/postinst" "$root/DEBIAN/prerm" "$root/DEBIAN/postrm"
chmod -R go=rX "$root"
dpkg-deb --build --root-owner-group "$root" "$out/${name}_${version}_$architecture.deb"
