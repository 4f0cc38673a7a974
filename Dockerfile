# The program in a bare Debian 12, as README.md has it. docs/install.md
FROM debian:12
RUN apt-get update && apt-get install -y git make
COPY . /mild
WORKDIR /mild
RUN make build
ENTRYPOINT ["build/mild"]
CMD ["play"]
